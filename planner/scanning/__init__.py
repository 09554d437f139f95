"""The scan itself: probe, latched angles, calibration, the cloud in one frame, and its error budget."""
