"""What was seen in a frame: from files (`files`), from models (`models`), or from the depth alone (`segment`)."""
