"""The modes of all laws at one instant: mode rules and one complementarity problem, for events, starts and operating points."""
