"""Reference values of tests/emg.rs: SciPy's butter and filtfilt on a synthetic signal. Prints emg_scipy.json."""

import json

import numpy as np
import scipy
from scipy.signal import butter, filtfilt

RATE_HZ, SAMPLES, EVERY = 1000.0, 4400, 53

t = np.arange(SAMPLES) / RATE_HZ
burst = 0.1 + np.maximum(0.0, np.sin(2 * np.pi * t / 1.1))
raw = burst * np.sin(2 * np.pi * 83.0 * t) + 0.2 * np.sin(2 * np.pi * 211.0 * t + 1.0) + 0.4 * np.sin(2 * np.pi * 7.0 * t) + 0.5
band = filtfilt(*butter(4, [20.0, 450.0], "bandpass", fs=RATE_HZ), raw)
envelope = filtfilt(*butter(4, 6.0, "lowpass", fs=RATE_HZ), np.abs(band))
print(json.dumps({"scipy": scipy.__version__, "every": EVERY, "envelope": envelope[::EVERY].tolist()}, indent=1))
