"""What each figure of a study shows, in words that need no other text: by study and by the name of the figure."""

LAYER = (
    "{what} over the thickness of the {layer} layer of a clamped cylinder, for the first (primary) and the second "
    "(secondary) wave that comes back. Bands: dashpots γ from 4 to 6 N s/m. Black: theory."
)
MAP = "Force at bead 7 over time (horizontal) and {what} (vertical). Bright bands are waves: down the chain, then back."

CAPTIONS = {
    "thesis": {
        "verdicts": "Verdicts on printed numbers and statements, by part.",
        "ratios": "Ours over the printed number, where both are single ones. Points beyond 0.5 and 2 lie at the ends.",
    },
    "aspect-ratio": {
        "amplitude_ratio": (
            "Amplitude ratio of the reflected wave over bead diameter D by plate thickness t, far from all edges. "
            "The plate takes the more energy, the larger the bead is for the plate. Lines: Zener's theory of "
            "impacts."
        ),
        "time_of_flight": (
            "Time of flight, and the same over the bead diameter, which depends on D/t alone. Lines: Zener's theory."
        ),
        "forces": "Force at a sensor over time for beads of several sizes on plates of several thicknesses.",
    },
    "plate-boundary": {
        "amplitude_ratio": (
            "Amplitude ratio AR of the reflected wave over the distance from a clamped edge, for bead diameters D "
            "and plate thicknesses t. Beyond the critical distance the edge no longer matters."
        ),
        "time_of_flight": (
            "Time of flight over the distance from a clamped edge, for bead diameters D and plate thicknesses t."
        ),
        "critical_distance": (
            "Critical distance from the edge over the bead diameter: beyond it AR stays within ± 0.02 of its value far "
            "from the edge. Bars: between which two runs it lies. Lines: "
            "how far a wave travels during the contact, at the speed of the A0 Lamb and of the Rayleigh wave."
        ),
        "refinement": (
            "How far AR differs from its value far from the edge, around the last crossing of the tolerance: "
            "first scan, and the refined bracket."
        ),
        "edges": "Amplitude ratio AR over the distance from the edge, for other supports of the edge.",
    },
    "critical-distance": {
        "collapse": (
            "AR over the distance from the edge in units of the length that waves travel during a contact: curves "
            "of different plates and beads fall on one another."
        ),
        "critical_distance": (
            "The critical distance in these units over the inelasticity parameter λ: the law, its bounds, and "
            "simulated values."
        ),
        "jumps": (
            "Where the critical distance jumps: AR oscillates, and its last crossing of the tolerance changes "
            "from one oscillation to another."
        ),
        "materials": "Critical distances for several materials.",
        "shear": "What the shear of thick plates changes.",
        "corner": "Critical distance in a corner, where two edges meet.",
    },
    "rod-stiffness": {
        "stiffness": (
            "Time of flight and amplitude ratio over Young's modulus of a clamped cylinder, for the first "
            "(primary) and the second (secondary) wave that comes back."
        ),
        "force_intensity": MAP.format(what="Young's modulus of the cylinder"),
        "force_histories": "Force at two beads over time against steel and against PTFE. PTFE returns two waves.",
        "displacements": (
            "Displacements of all beads against steel and PTFE; the last bead is red. Against PTFE it hits its "
            "neighbour twice, and each collision sends a wave back."
        ),
    },
    "rod-length": {
        "length": (
            "Time of flight and amplitude ratio over the length of a clamped steel cylinder. Dotted: the length c "
            "T/2 whose echo returns at the end of the contact (bar speed c, contact time T)."
        ),
        "force_intensity": MAP.format(what="the length of the cylinder"),
    },
    "upper-layer": {
        "time_of_flight": LAYER.format(what="Time of flight", layer="upper, steel,"),
        "amplitude_ratio": LAYER.format(what="Amplitude ratio", layer="upper, steel,"),
        "force_intensity": MAP.format(what="the thickness of the steel layer"),
    },
    "lower-layer": {
        "time_of_flight": LAYER.format(what="Time of flight", layer="lower, PTFE,"),
        "amplitude_ratio": LAYER.format(what="Amplitude ratio", layer="lower, PTFE,"),
        "force_intensity": MAP.format(what="the thickness of the PTFE layer"),
    },
    "ellipsoids": {
        "particle_size": (
            "Speed of the solitary wave over its peak contact force in chains of steel spheres of four sizes."
        ),
        "ellipsoids": (
            "Wave speed over peak contact force in chains of ellipsoids that lie along or across the chain, and "
            "of spheres of the same mass."
        ),
    },
    "cylinders": {
        "speed_force": (
            "Wave speed over peak contact force in chains of crossed cylinders, for three angles between neighbours."
        ),
        "angle": "Wave speed over the angle between neighbouring cylinders, in units of that at 90°.",
        "laws": "Contact force over approach for cylinders that cross at several angles.",
    },
    "hollow-spheres": {
        "speed_force": "Wave speed over peak contact force in chains of hollow spheres of several walls.",
        "exponents": "The same for a solid and a thin sphere on logarithmic axes, whose slopes are the exponents.",
        "laws": "Contact force over approach of hollow spheres: simulated, and by finite elements.",
    },
    "dissipation": {
        "decay": "Peak force of the wave over the beads it has passed, for several losses.",
        "speed_over_force": "Wave speed over the peak force as both decay along the chain.",
        "laws": "Laws of loss compared.",
    },
    "deformable-chain": {
        "section": (
            "Force through the central section of a deformable bead over time, compared with the mean of its two "
            "contact forces, and their difference."
        ),
        "sensors": "Force at the centres of several beads over time.",
        "speed_force": (
            "Wave speed over peak force in chains of deformable and of rigid beads, and in units of the theory."
        ),
        "contacts": "Forces of the contacts over time.",
        "meshes": "What finer meshes change.",
        "modes": "What more modes of vibration of the beads change.",
    },
    "contact-law": {
        "spheres": "Contact force over approach of two spheres: finite elements and Hertz's law.",
        "ellipsoids": "Contact force over approach of ellipsoids: finite elements and Hertz's law.",
        "cylinders": "Contact force over approach of parallel and crossed cylinders.",
        "exponents": "Exponents of the contact laws over the angle between cylinders.",
        "hollow_spheres": "Contact force over approach of hollow spheres.",
        "convergence": "How the laws change with finer meshes.",
    },
    "symmetry": {
        "waves": "Force at the centres of two beads over time, computed with axial symmetry and in three dimensions.",
    },
    "identifiability": {
        "distance": (
            "How well the distance of a clamped edge can be known from a record of the length in the title: half of "
            "the 95 % interval over the distance and the plate's thickness, for each way to measure (columns) and "
            "bead diameter (rows). Hatched: blind, as it exceeds half of the distance."
        ),
        "bond": (
            "How well a bond under steel or PTFE can be known from a trace: half of the 95 % interval. Blind "
            "where it exceeds half of the value."
        ),
    },
    "yield": {
        "speed": (
            "What yielding takes over the impact speed: the incident force at bead 7 over that of elastic beads, and "
            "the amplitude ratio of hardened beads on half-spaces of softer metals. Grey: speeds at which "
            "plates (0.31 m/s) and rods (0.44 m/s) are struck."
        ),
        "waves": "Force at bead 7 of a chain on a steel rod and on a plate, elastic and by both laws of yielding.",
    },
    "prestress": {
        "stress": (
            "Amplitude ratio and time of flight less their values without stress, over the stress, in a plate, a strip "
            "and a rail. The scales are linear around zero and logarithmic beyond."
        ),
    },
    "cracks": {
        "amplitude": (
            "Amplitude ratio over the impact speed for gaps of several widths. Dashed and dotted: what linear models "
            "give for a gap that is always closed and for one that never closes."
        ),
    },
    "pressure": {
        "pressure": (
            "Amplitude ratio and time of flight less their values without pressure, over the pressure inside in units "
            "of the pressure outside that would buckle the shell. Outer radius and thickness of each shell are given."
        ),
    },
}
"""A figure that is missing here is named by its file. A name such as "distance" also stands for "distance_1.4_ms"."""
