"""What a person starts: a scenario, a calibration session, a sweep or a study."""
