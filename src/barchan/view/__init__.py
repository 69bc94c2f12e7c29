"""Pictures: figures fit for a paper, with units and colours that colour-blind readers can tell apart."""
