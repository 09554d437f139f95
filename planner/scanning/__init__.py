"""The scan itself: the probe, latched angles, calibration, the cloud in one frame, and the account of its errors."""
