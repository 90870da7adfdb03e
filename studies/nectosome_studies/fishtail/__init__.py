"""The pneumatic fishtail: hysteresis and dynamics from recordings (Xiong, Sun and Meng 2025)."""
