"""The parameter array of a tyre: one flat float64 array, and the index of every coefficient in it.

The kernels read `p[PCX1]`, not `params.pcx1`, so that the same compiled code serves Python, the vectorised call and the
native callback, which finds the array in a numeric block of the model. A coefficient's index is its place in
`coefficients.COEFFICIENTS` (a test holds the two together); what the package adds itself follows behind.
"""

from __future__ import annotations

# fmt: off
(
    # [MODEL]
    FITTYP, LONGVL, VXLOW,
    # [DIMENSION]
    UNLOADED_RADIUS, WIDTH, RIM_RADIUS, RIM_WIDTH, ASPECT_RATIO,
    # [OPERATING_CONDITIONS]
    INFLPRES, NOMPRES,
    # [INERTIA]
    MASS, IXX, IYY, BELT_MASS, BELT_IXX, BELT_IYY, GRAVITY,
    # [VERTICAL]
    FNOMIN, VERTICAL_STIFFNESS, VERTICAL_DAMPING, MC_CONTOUR_A, MC_CONTOUR_B, BREFF, DREFF, FREFF, Q_RE0, Q_V1,
    Q_V2, Q_FZ1, Q_FZ2, Q_FZ3, Q_FCX, Q_FCY, Q_FCY2, Q_CAM, Q_CAM1, Q_CAM2, Q_CAM3, Q_FYS1, Q_FYS2, Q_FYS3,
    PFZ1, BOTTOM_OFFST, BOTTOM_STIFF,
    # [STRUCTURAL]
    LONGITUDINAL_STIFFNESS, LATERAL_STIFFNESS, YAW_STIFFNESS, FREQ_LONG, FREQ_LAT, FREQ_YAW, FREQ_WINDUP,
    DAMP_LONG, DAMP_LAT, DAMP_YAW, DAMP_WINDUP, DAMP_RESIDUAL, DAMP_VLOW, Q_BVX, Q_BVT, PCFX1, PCFX2, PCFX3,
    PCFY1, PCFY2, PCFY3, PCMZ1,
    # [CONTACT_PATCH]
    Q_RA1, Q_RA2, Q_RB1, Q_RB2, ELLIPS_SHIFT, ELLIPS_LENGTH, ELLIPS_HEIGHT, ELLIPS_ORDER, ELLIPS_MAX_STEP,
    ELLIPS_NWIDTH, ELLIPS_NLENGTH,
    # [INFLATION_PRESSURE_RANGE]
    PRESMIN, PRESMAX,
    # [VERTICAL_FORCE_RANGE]
    FZMIN, FZMAX,
    # [LONG_SLIP_RANGE]
    KPUMIN, KPUMAX,
    # [SLIP_ANGLE_RANGE]
    ALPMIN, ALPMAX,
    # [INCLINATION_ANGLE_RANGE]
    CAMMIN, CAMMAX,
    # [SCALING_COEFFICIENTS]
    LFZO, LCX, LMUX, LEX, LKX, LHX, LVX, LCY, LMUY, LEY, LKY, LHY, LVY, LTR, LRES, LXAL, LYKA, LVYKA, LS, LKYC,
    LKZC, LVMX, LMX, LMY, LMP, LGAX, LGAY, LGAZ, LSGKP, LSGAL, LGYR, LCZ,
    # [LONGITUDINAL_COEFFICIENTS]
    PCX1, PDX1, PDX2, PDX3, PEX1, PEX2, PEX3, PEX4, PKX1, PKX2, PKX3, PHX1, PHX2, PVX1, PVX2, PPX1, PPX2, PPX3,
    PPX4, RBX1, RBX2, RBX3, RCX1, REX1, REX2, RHX1, PTX1, PTX2, PTX3,
    # [OVERTURNING_COEFFICIENTS]
    QSX1, QSX2, QSX3, QSX4, QSX5, QSX6, QSX7, QSX8, QSX9, QSX10, QSX11, QSX12, QSX13, QSX14, PPMX1,
    # [LATERAL_COEFFICIENTS]
    PCY1, PDY1, PDY2, PDY3, PEY1, PEY2, PEY3, PEY4, PEY5, PKY1, PKY2, PKY3, PKY4, PKY5, PKY6, PKY7, PHY1, PHY2,
    PHY3, PVY1, PVY2, PVY3, PVY4, PPY1, PPY2, PPY3, PPY4, PPY5, RBY1, RBY2, RBY3, RBY4, RCY1, REY1, REY2, RHY1,
    RHY2, RVY1, RVY2, RVY3, RVY4, RVY5, RVY6, PTY1, PTY2,
    # [ROLLING_COEFFICIENTS]
    QSY1, QSY2, QSY3, QSY4, QSY5, QSY6, QSY7, QSY8,
    # [ALIGNING_COEFFICIENTS]
    QBZ1, QBZ2, QBZ3, QBZ4, QBZ5, QBZ9, QBZ10, QCZ1, QDZ1, QDZ2, QDZ3, QDZ4, QDZ6, QDZ7, QDZ8, QDZ9, QDZ10,
    QDZ11, QEZ1, QEZ2, QEZ3, QEZ4, QEZ5, QHZ1, QHZ2, QHZ3, QHZ4, PPZ1, PPZ2, SSZ1, SSZ2, SSZ3, SSZ4, QTZ1,
    MBELT,
    # [TURNSLIP_COEFFICIENTS]
    PDXP1, PDXP2, PDXP3, PKYP1, PDYP1, PDYP2, PDYP3, PDYP4, PHYP1, PHYP2, PHYP3, PHYP4, PECP1, PECP2, QDTP1,
    QCRP1, QCRP2, QBRP1, QDRP1, QDRP2,
) = range(271)

(
    # Not in any file: what `parameter_array` decides.
    MF_VERSION,     # 52, 60, 61 or 62
    SLIP_TANGENT,   # 0: alpha* = alpha and gamma* = gamma; 1: alpha* = tan(alpha) and gamma* = sin(gamma)
    SIDE,           # +1: mounted on the side of the file; -1: on the other side, everything mirrored
    PTX_GIVEN,      # 1 where the file gives PTX1 (MF 5.2 relaxation length of Fx)
    PTY_GIVEN,      # 1 where the file gives PTY1 (MF 5.2 relaxation length of Fy)
    Q_RA_GIVEN,     # 1 where the file gives the contact length
    Q_RB_GIVEN,     # 1 where the file gives the contact width
) = range(271, 278)

(
    # How the coefficients are evaluated: `conventions.TyreConventions`; 0 and 1 where not said otherwise.
    CAMBER_OFF, RELAXATION_OFF, FRICTION_ELLIPSE, SCALE_PEAKS_ONLY, SLIP_AT_CENTRE, RADIUS_BY_DEFLECTION,
    TRAIL_BY_SCALED_LOAD,
    SPEED_OFFSET,         # [m/s]
    REFERENCE_FRICTION,
) = range(278, 287)
# fmt: on

PARAMETER_COUNT = 287
"""Length of the parameter array."""
