"""What reads a plant: the sensor and its logger."""
