"""A crack of 0.3 µm in a rod: slow taps see it open, fast ones closed. A linear model knows one of both only."""

import hertzlink as hl

UNTIL = 1.2e-3  # s
near, far = (hl.Layer(hl.ALUMINIUM_6061, length, radius=6e-3) for length in (0.05, 0.15))
cut = hl.reduce(hl.rod([near, far], cracks=[0]), until=UNTIL)
bonded = hl.reduce(hl.rod([near, far]), until=UNTIL)
bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)

speeds, ratios = (0.05, 0.2, 0.8), dict[str, list[float]]()
for speed in speeds:
    chain = hl.Chain([bead] * 20, striker=bead, impact_speed=speed)
    for name, body in (
        ("never closes", hl.stepping.Closing(cut, opening=[1e-3])),
        ("crack of 0.3 µm", hl.stepping.Closing(cut, opening=[0.3e-6])),
        ("bonded", bonded),
    ):
        run = hl.CoSimulation(chain, body).run(until=UNTIL)
        ratio = float(hl.amplitude_ratio(run, sensor=12))
        ratios.setdefault(name, []).append(ratio)
        print(f"at {speed} m/s, {name}: AR {ratio:.3f}")
