"""Compiled formulas of the tyre on plain floats.

Arguments of the kernels with the symbols of their source (Pacejka, Tire and Vehicle Dynamics, 2012, section 4.3.2;
SI and radians, ISO-W axes at the contact point):

    p                   record of the tyre, `record.TYRE_RECORD`
    fz                  load [N], > 0
    dfz, dpi            load and inflation pressure relative to the nominal ones, minus 1
    pressure            inflation pressure [Pa]
    kappa               longitudinal slip, positive drives
    alpha, tan_alpha    slip angle [rad] and its tangent
    gamma               camber [rad], positive about +x
    alpha_s, gamma_s    alpha* and gamma*: tangent and sine of the angles, or the angles, as the tyre says
    vx                  speed along the wheel's heading [m/s]
    turn_slip           yaw rate over speed [1/m], positive to the left; MF 6.x only
    d                   rolling direction, 1 forward, -1 backward, between them below walking speed
    mu                  friction of the road relative to the friction of the file
    lmux, lmuy, lmu     friction scales, longitudinal and lateral; lmu for the kernel's own force
    fx, fy, mx, my, mz  forces [N] and moments [N m]; fx0, fy0 at pure slip, fy_trail on the trail
    k_x, k_y            slip stiffness [N], cornering stiffness [N/rad]
    b_y, c_y, dx, dy    stiffness and shape factor of the lateral force, peaks of both forces [N]
    s_hy, s_vy          horizontal and vertical shift of the lateral force [-], [N]
    g_y                 weight of the lateral force at combined slip
    z0 to z8            turn slip factors zeta

In: coefficients, slip, load and road.
Out: forces and moments, for compiled code and for arrays.
"""
