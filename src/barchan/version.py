"""The version of barchan."""

VERSION = "0.2.0"
