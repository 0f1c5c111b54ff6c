"""Reads files of every format with common safety checks, and writes files atomically."""
