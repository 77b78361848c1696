"""How CasADi expressions become numbers fast: tapes, sparse elimination, functions bound to arrays, the C compiler."""
