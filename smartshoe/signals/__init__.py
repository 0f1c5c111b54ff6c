"""Basic analysis of sampled signals: runs of good samples, lags, noise, ramps and cycles of a load."""
