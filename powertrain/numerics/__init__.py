"""How expressions become numbers: functions at one point and at many, Newton steps, sparse elimination, the C compiler."""
