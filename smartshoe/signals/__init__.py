"""What a load signal is made of: runs of good samples, ramps, cycles."""
