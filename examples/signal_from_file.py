"""A signal from an oscilloscope's file: the reflected waves and their times. (The file is simulated; see
its header.)
"""

from pathlib import Path

import hertzlink as hl

signal = hl.read_signal(Path(__file__).with_name("signal.csv"), sensors={7: 1}, calibration=25.0)  # N/V

waves = hl.reflections(signal, sensor=7)
print(f"incident {waves.incident.amplitude:.1f} N")
print(f"AR {waves.primary.amplitude_ratio:.3f}, TOF {waves.primary.time_of_flight * 1e6:.1f} us")
