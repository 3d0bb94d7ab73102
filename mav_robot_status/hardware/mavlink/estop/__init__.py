"""Emergency stops: what says that one is engaged or released."""
