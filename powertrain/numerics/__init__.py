"""How expressions become numbers: functions at one point and at many, Newton's method, sparse elimination, the C compiler."""
