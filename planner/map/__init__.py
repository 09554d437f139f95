"""The grayscale configuration map: what every table angle is worth at every scan location."""
