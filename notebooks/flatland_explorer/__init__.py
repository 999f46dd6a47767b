"""The parts of the explorer: a flatland scene under the mouse, and what the library says of it.

- `board`: the scene as a table of parts that a hand can change, and back;
- `handles`: where a part is taken hold of, and what becomes of the table when a handle is moved;
- `files`: TOML, SVG and Python;
- `programs`: compiled functions of a scene, whose sizes do not depend on where its parts are;
- `paths`: the light from the lamp to the probe as a path of events;
- `asked`: what falls on the receiver and what it sees, with the jumps;
- `panels`: the numbers of each picture, as dictionaries;
- `widget`: the page; `pictures.js` draws the numbers and `page.js` listens to the mouse.
"""
