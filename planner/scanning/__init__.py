"""The scan itself: the probe, latched angles, calibration, the cloud in one frame, and its error budget."""
