"""The table of .tir keys that `coefficients` reads: key, default, quantity, meaning. Data only."""

TABLE = """
[MODEL]
FITTYP 61 1 version of the Magic Formula: 6 and 21 are MF 5.2, 60, 61 and 62 are MF 6.x
LONGVL 16.7 speed speed at which the tyre was measured, reference of the speed terms
VXLOW 1.0 speed speed below which what depends on the rolling direction fades out
[DIMENSION]
UNLOADED_RADIUS ! length free radius of the tyre
WIDTH 0.205 length nominal section width
RIM_RADIUS - length nominal rim radius; without it 60 percent of the free radius
RIM_WIDTH 0.152 length rim width
ASPECT_RATIO 0.6 1 nominal ratio of section height to width
[OPERATING_CONDITIONS]
INFLPRES - pressure inflation pressure; without it NOMPRES
NOMPRES - pressure pressure of the measurement; without it INFLPRES, and 2.2 bar without both
[INERTIA]
MASS 0.0 mass mass of the tyre
IXX 0.0 inertia moment of inertia of the tyre about a diameter
IYY 0.0 inertia moment of inertia of the tyre about its axis
BELT_MASS 0.0 mass mass of the belt
BELT_IXX 0.0 inertia moment of inertia of the belt about a diameter
BELT_IYY 0.0 inertia moment of inertia of the belt about its axis
GRAVITY -9.81 acceleration gravity acting on the belt
[VERTICAL]
FNOMIN ! force nominal load
VERTICAL_STIFFNESS - stiffness vertical stiffness at the nominal load; without it from Q_FZ1 and Q_FZ2
VERTICAL_DAMPING 50.0 damping vertical damping
MC_CONTOUR_A 0.0 1 motorcycle contour ellipse
MC_CONTOUR_B 0.0 1 motorcycle contour ellipse
BREFF 8.4 1 effective rolling radius: stiffness at low load
DREFF 0.27 1 effective rolling radius: peak
FREFF 0.07 1 effective rolling radius: stiffness at high load
Q_RE0 1.0 1 ratio of the free rolling radius to the nominal one
Q_V1 0.0 1 growth of the radius with the square of speed
Q_V2 0.0 1 growth of the vertical stiffness with speed
Q_FZ1 - 1 linear vertical stiffness; without it from VERTICAL_STIFFNESS
Q_FZ2 0.0 1 quadratic vertical stiffness
Q_FZ3 0.0 1 linear vertical stiffness: camber squared
Q_FCX 0.0 1 softening of the vertical stiffness by longitudinal force
Q_FCY 0.0 1 softening of the vertical stiffness by lateral force
Q_FCY2 0.0 1 the same: exponent of the deflection (MF 6.2)
Q_CAM 0.0 1 vertical stiffness: camber (MF 6.1)
Q_CAM1 0.0 1 vertical force: camber, linear in the radius (MF 6.2)
Q_CAM2 0.0 1 vertical force: camber, quadratic in the radius (MF 6.2)
Q_CAM3 0.0 1 vertical force: camber, reduction of the deflection (MF 6.2)
Q_FYS1 0.0 1 vertical force: lateral force by camber, constant (MF 6.2)
Q_FYS2 0.0 1 vertical force: lateral force by camber, linear in the radius (MF 6.2)
Q_FYS3 0.0 1 vertical force: lateral force by camber, quadratic in the radius (MF 6.2)
PFZ1 0.0 1 vertical stiffness: pressure
BOTTOM_OFFST 0.01 length distance to the rim at which it bottoms
BOTTOM_STIFF 2.0e6 stiffness vertical stiffness of the bottomed rim
[STRUCTURAL]
LONGITUDINAL_STIFFNESS - stiffness longitudinal stiffness of the carcass; without it 300 kN/m
LATERAL_STIFFNESS - stiffness lateral stiffness of the carcass; without it 100 kN/m
YAW_STIFFNESS 0.0 angular_stiffness yaw stiffness of the carcass
FREQ_LONG 0.0 1 undamped frequency of the belt, fore and aft [Hz]
FREQ_LAT 0.0 1 undamped frequency of the belt, lateral [Hz]
FREQ_YAW 0.0 1 undamped frequency of the belt, yaw [Hz]
FREQ_WINDUP 0.0 1 undamped frequency of the belt, wind-up [Hz]
DAMP_LONG 0.0 1 damping ratio of the belt, fore and aft
DAMP_LAT 0.0 1 damping ratio of the belt, lateral
DAMP_YAW 0.0 1 damping ratio of the belt, yaw
DAMP_WINDUP 0.0 1 damping ratio of the belt, wind-up
DAMP_RESIDUAL 0.002 1 residual damping ratio
DAMP_VLOW 0.001 1 additional damping ratio at low speed
Q_BVX 0.0 1 stiffness of the belt: load and speed, translation
Q_BVT 0.0 1 stiffness of the belt: load and speed, rotation
PCFX1 0.0 1 longitudinal stiffness: load
PCFX2 0.0 1 longitudinal stiffness: load squared
PCFX3 0.0 1 longitudinal stiffness: pressure
PCFY1 0.0 1 lateral stiffness: load
PCFY2 0.0 1 lateral stiffness: load squared
PCFY3 0.0 1 lateral stiffness: pressure
PCMZ1 0.0 1 yaw stiffness: pressure
[CONTACT_PATCH]
Q_RA1 - 1 contact length: square root of the load; without both an estimate stands in
Q_RA2 - 1 contact length: load
Q_RB1 - 1 contact width: cube root of the load; without both the tyre's width stands in
Q_RB2 - 1 contact width: load
ELLIPS_SHIFT 0.8 1 envelope of the contact patch: shift
ELLIPS_LENGTH 1.5 1 envelope of the contact patch: length
ELLIPS_HEIGHT 1.0 1 envelope of the contact patch: height
ELLIPS_ORDER 1.8 1 envelope of the contact patch: order
ELLIPS_MAX_STEP 0.025 length envelope of the contact patch: highest step
ELLIPS_NWIDTH 10.0 1 envelope of the contact patch: ellipses across
ELLIPS_NLENGTH 10.0 1 envelope of the contact patch: ellipses along
[INFLATION_PRESSURE_RANGE]
PRESMIN 10000.0 pressure smallest valid pressure
PRESMAX 1.0e6 pressure greatest valid pressure
[VERTICAL_FORCE_RANGE]
FZMIN 0.0 force smallest valid load
FZMAX - force greatest valid load; without it 2.5 times the nominal load
[LONG_SLIP_RANGE]
KPUMIN -1.5 1 smallest valid longitudinal slip
KPUMAX 1.5 1 greatest valid longitudinal slip
[SLIP_ANGLE_RANGE]
ALPMIN -1.5 angle smallest valid slip angle
ALPMAX 1.5 angle greatest valid slip angle
[INCLINATION_ANGLE_RANGE]
CAMMIN -0.175 angle smallest valid camber
CAMMAX 0.175 angle greatest valid camber
[SCALING_COEFFICIENTS]
LFZO 1 1 scale of the nominal load
LCX 1 1 scale of the Fx shape factor
LMUX 1 1 scale of the Fx peak friction
LEX 1 1 scale of the Fx curvature
LKX 1 1 scale of the Fx slip stiffness
LHX 1 1 scale of the Fx horizontal shift
LVX 1 1 scale of the Fx vertical shift
LCY 1 1 scale of the Fy shape factor
LMUY 1 1 scale of the Fy peak friction
LEY 1 1 scale of the Fy curvature
LKY 1 1 scale of the cornering stiffness
LHY 1 1 scale of the Fy horizontal shift
LVY 1 1 scale of the Fy vertical shift
LTR 1 1 scale of the pneumatic trail
LRES 1 1 scale of the residual moment's offset
LXAL 1 1 scale of the slip angle's influence on Fx
LYKA 1 1 scale of the longitudinal slip's influence on Fy
LVYKA 1 1 scale of the Fy induced by longitudinal slip
LS 1 1 scale of the moment arm of Fx
LKYC 1 1 scale of the camber stiffness (MF 6.x)
LKZC 1 1 scale of the camber torque stiffness (MF 6.x)
LVMX 1 1 scale of the Mx vertical shift
LMX 1 1 scale of the overturning moment
LMY 1 1 scale of the rolling resistance moment
LMP 1 1 scale of the parking moment
LGAX 1 1 scale of camber for Fx (MF 5.2)
LGAY 1 1 scale of camber for Fy (MF 5.2)
LGAZ 1 1 scale of camber for Mz (MF 5.2)
LSGKP 1 1 scale of the relaxation length of Fx (MF 5.2)
LSGAL 1 1 scale of the relaxation length of Fy (MF 5.2)
LGYR 1 1 scale of the gyroscopic moment (MF 5.2)
LCZ 1 1 scale of the vertical stiffness
[LONGITUDINAL_COEFFICIENTS]
PCX1 ! 1 shape factor of Fx
PDX1 ! 1 longitudinal friction at the nominal load
PDX2 0 1 longitudinal friction: load
PDX3 0 1 longitudinal friction: camber squared
PEX1 0 1 curvature of Fx
PEX2 0 1 curvature of Fx: load
PEX3 0 1 curvature of Fx: load squared
PEX4 0 1 curvature of Fx: driving or braking
PKX1 ! 1 slip stiffness over load at the nominal load
PKX2 0 1 slip stiffness: load
PKX3 0 1 slip stiffness: exponent of load
PHX1 0 1 horizontal shift of Fx
PHX2 0 1 horizontal shift of Fx: load
PVX1 0 1 vertical shift of Fx
PVX2 0 1 vertical shift of Fx: load
PPX1 0 1 slip stiffness: pressure
PPX2 0 1 slip stiffness: pressure squared
PPX3 0 1 longitudinal friction: pressure
PPX4 0 1 longitudinal friction: pressure squared
RBX1 0 1 slope of the Fx reduction by slip angle
RBX2 0 1 slope of the Fx reduction: longitudinal slip
RBX3 0 1 slope of the Fx reduction: camber
RCX1 0 1 shape of the Fx reduction
REX1 0 1 curvature of the Fx reduction
REX2 0 1 curvature of the Fx reduction: load
RHX1 0 1 shift of the Fx reduction
PTX1 - 1 relaxation length of Fx over load (MF 5.2); without it from the stiffnesses
PTX2 0 1 relaxation length of Fx: load (MF 5.2)
PTX3 0 1 relaxation length of Fx: exponent of load (MF 5.2)
[OVERTURNING_COEFFICIENTS]
QSX1 0 1 overturning moment: shift
QSX2 0 1 overturning moment: camber
QSX3 0 1 overturning moment: lateral force
QSX4 0 1 overturning moment: mixed term, load, camber and lateral force
QSX5 0 1 overturning moment: mixed term, shape over load
QSX6 0 1 overturning moment: mixed term, slope over load
QSX7 0 1 overturning moment: mixed term, camber
QSX8 0 1 overturning moment: mixed term, lateral force
QSX9 0 1 overturning moment: mixed term, slope over lateral force
QSX10 0 1 overturning moment: camber by load
QSX11 0 1 overturning moment: camber by load, slope
QSX12 0 1 overturning moment: camber squared
QSX13 0 1 overturning moment: lateral force, added
QSX14 0 1 overturning moment: lateral force by camber, added
PPMX1 0 1 overturning moment: pressure
[LATERAL_COEFFICIENTS]
PCY1 ! 1 shape factor of Fy
PDY1 ! 1 lateral friction at the nominal load
PDY2 0 1 lateral friction: load
PDY3 0 1 lateral friction: camber squared
PEY1 0 1 curvature of Fy
PEY2 0 1 curvature of Fy: load
PEY3 0 1 curvature of Fy: sign of the slip angle
PEY4 0 1 curvature of Fy: sign of the slip angle by camber
PEY5 0 1 curvature of Fy: camber squared
PKY1 ! 1 greatest cornering stiffness over nominal load
PKY2 ! 1 load of the greatest cornering stiffness over nominal load
PKY3 0 1 cornering stiffness: camber
PKY4 2 1 cornering stiffness: curvature over load
PKY5 0 1 cornering stiffness: load of the greatest one by camber squared
PKY6 0 1 camber stiffness
PKY7 0 1 camber stiffness: load
PHY1 0 1 horizontal shift of Fy
PHY2 0 1 horizontal shift of Fy: load
PHY3 0 1 horizontal shift of Fy: camber (MF 5.2)
PVY1 0 1 vertical shift of Fy
PVY2 0 1 vertical shift of Fy: load
PVY3 0 1 vertical shift of Fy: camber
PVY4 0 1 vertical shift of Fy: camber by load
PPY1 0 1 cornering stiffness: pressure
PPY2 0 1 cornering stiffness: load of the greatest one by pressure
PPY3 0 1 lateral friction: pressure
PPY4 0 1 lateral friction: pressure squared
PPY5 0 1 camber stiffness: pressure
RBY1 0 1 slope of the Fy reduction by longitudinal slip
RBY2 0 1 slope of the Fy reduction: slip angle
RBY3 0 1 slope of the Fy reduction: shift of the slip angle
RBY4 0 1 slope of the Fy reduction: camber
RCY1 0 1 shape of the Fy reduction
REY1 0 1 curvature of the Fy reduction
REY2 0 1 curvature of the Fy reduction: load
RHY1 0 1 shift of the Fy reduction
RHY2 0 1 shift of the Fy reduction: load
RVY1 0 1 Fy induced by longitudinal slip
RVY2 0 1 Fy induced by longitudinal slip: load
RVY3 0 1 Fy induced by longitudinal slip: camber
RVY4 0 1 Fy induced by longitudinal slip: slip angle
RVY5 0 1 Fy induced by longitudinal slip: shape
RVY6 0 1 Fy induced by longitudinal slip: slope
PTY1 - 1 greatest relaxation length of Fy over the radius (MF 5.2); without it from the stiffnesses
PTY2 1 1 load of the greatest relaxation length over the nominal one (MF 5.2)
[ROLLING_COEFFICIENTS]
QSY1 0 1 rolling resistance
QSY2 0 1 rolling resistance: longitudinal force
QSY3 0 1 rolling resistance: speed
QSY4 0 1 rolling resistance: speed to the fourth
QSY5 0 1 rolling resistance: camber squared
QSY6 0 1 rolling resistance: camber squared by load
QSY7 1 1 rolling resistance: exponent of load
QSY8 0 1 rolling resistance: exponent of pressure
[ALIGNING_COEFFICIENTS]
QBZ1 0 1 slope of the trail
QBZ2 0 1 slope of the trail: load
QBZ3 0 1 slope of the trail: load squared
QBZ4 0 1 slope of the trail: camber
QBZ5 0 1 slope of the trail: absolute camber
QBZ9 0 1 slope of the residual moment: stiffness scale over friction scale
QBZ10 0 1 slope of the residual moment: By Cy
QCZ1 0 1 shape factor of the trail
QDZ1 0 1 greatest trail
QDZ2 0 1 greatest trail: load
QDZ3 0 1 greatest trail: camber
QDZ4 0 1 greatest trail: camber squared
QDZ6 0 1 residual moment
QDZ7 0 1 residual moment: load
QDZ8 0 1 residual moment: camber
QDZ9 0 1 residual moment: camber by load
QDZ10 0 1 residual moment: camber squared
QDZ11 0 1 residual moment: camber squared by load
QEZ1 0 1 curvature of the trail
QEZ2 0 1 curvature of the trail: load
QEZ3 0 1 curvature of the trail: load squared
QEZ4 0 1 curvature of the trail: sign of the slip angle
QEZ5 0 1 curvature of the trail: sign of the slip angle by camber
QHZ1 0 1 horizontal shift of the trail
QHZ2 0 1 horizontal shift of the trail: load
QHZ3 0 1 horizontal shift of the trail: camber
QHZ4 0 1 horizontal shift of the trail: camber by load
PPZ1 0 1 trail: pressure
PPZ2 0 1 residual moment by camber: pressure
SSZ1 0 1 moment arm of Fx over the radius
SSZ2 0 1 moment arm of Fx: lateral force
SSZ3 0 1 moment arm of Fx: camber
SSZ4 0 1 moment arm of Fx: camber by load
QTZ1 0 1 gyroscopic moment (MF 5.2)
MBELT 0 mass mass of the belt in the gyroscopic moment (MF 5.2)
[TURNSLIP_COEFFICIENTS]
PDXP1 0.4 1 Fx reduction by turn slip
PDXP2 0 1 Fx reduction by turn slip: load
PDXP3 0 1 Fx reduction by turn slip: longitudinal slip
PKYP1 1 1 cornering stiffness reduction by turn slip
PDYP1 0.4 1 Fy reduction by turn slip
PDYP2 0 1 Fy reduction by turn slip: load
PDYP3 0 1 Fy reduction by turn slip: slip angle
PDYP4 0 1 Fy reduction by turn slip: square root of turn slip
PHYP1 1 1 Fy horizontal shift by turn slip: shape
PHYP2 0.15 1 Fy horizontal shift by turn slip: greatest
PHYP3 0 1 Fy horizontal shift by turn slip: load
PHYP4 -4 1 Fy horizontal shift by turn slip: curvature
PECP1 0.5 1 camber reduction factor of the spin
PECP2 0 1 camber reduction factor of the spin: load
QDTP1 10 1 trail reduction by turn slip
QCRP1 0.2 1 turning moment at constant turn slip and no speed
QCRP2 0.1 1 turning moment at 90 degrees of slip angle
QBRP1 0.1 1 residual moment reduction by turn slip
QDRP1 1 1 greatest turning moment
QDRP2 0 1 turning moment: curvature (MF 6.x before 6.1)
"""
