"""What models add to a map once: captions and names from best views, relations of near things, everyday knowledge."""
