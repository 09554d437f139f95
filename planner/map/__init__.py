"""The grayscale configuration map: the value of every table angle at every scan location."""
