"""A local page to change a run with sliders and to drive a car by hand: `activesteer explore`.

The browser talks to one server process (`server`) over a WebSocket. The server passes messages to one worker process
(`worker`), the only one that knows simulations: runs for the sliders (`runs`) and the drive by hand (`drive`).
"""
