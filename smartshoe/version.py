"""The version of this package, for results that name what made them."""

__version__ = "0.1.0"
