"""The readable twin of the compiled kernel, over CasADi's interpreter."""
