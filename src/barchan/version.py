"""The version of barchan."""

VERSION = "0.1.0"
