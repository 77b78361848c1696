"""Which modes of the laws hold: one complementarity problem behind events, starts and operating points."""
