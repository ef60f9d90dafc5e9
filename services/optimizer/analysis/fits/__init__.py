"""How far fitted parameters can be trusted."""
