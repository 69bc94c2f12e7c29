"""Who owns which sub-domain: one file for each strategy, from costs of sub-domains and speeds of ranks to owners."""
