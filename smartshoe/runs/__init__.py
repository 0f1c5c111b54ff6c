"""What a person starts: a scenario, a session, a sweep, a study."""
