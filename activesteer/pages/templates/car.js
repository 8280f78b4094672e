// A car from above, for the report and for `activesteer explore`: polygons of its body and of its wheels, in metres.
"use strict";
// x, y, yaw: its front axle over time; car: the table of `curves.py`; steer: mean angles of the front and of the rear wheels over time.
const carFromAbove = ({ x, y, yaw, car, steer }, i) => {
  const cos = Math.cos(yaw[i]), sin = Math.sin(yaw[i]), [rear, front] = car.ends, half = car.width / 2;
  const at = (ahead, left) => [x[i] + ahead * cos - left * sin, y[i] + ahead * sin + left * cos];
  const body = [[rear, half], [front - 0.4, half], [front, 0.6 * half], [front, -0.6 * half], [front - 0.4, -half], [rear, -half]];
  const wheels = !steer ? [] : car.wheels.map(([ahead, left], k) => {
    const angle = car.factors[k] * (steer[k >> 1][i] ?? 0), c = Math.cos(angle), s = Math.sin(angle);
    return [[0.36, 0.13], [0.36, -0.13], [-0.36, -0.13], [-0.36, 0.13]].map(([a, b]) => at(ahead + a * c - b * s, left + a * s + b * c));
  });
  return [body.map(([ahead, left]) => at(ahead, left)), ...wheels];
};
