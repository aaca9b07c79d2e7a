"""What `~` means: encoders make vectors, texts and words are matched, scoring makes degrees of it all."""
