"""Frames and detections to objects: lift, associate, fuse, tidy; `mapper` is the loop."""
