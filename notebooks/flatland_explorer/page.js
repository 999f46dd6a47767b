// The page: it listens to the mouse, tells Python where it went, and draws what comes back.
//
// It follows `pictures.js`, with which it makes one module (see `widget.py`).

const REACH = 9; // pixels within which a handle is taken
const ADD = ["lamp", "strip", "disc", "mirror", "point"];

function render({ model, el }) {
  const ui = { selected: null }, root = document.createElement("div"), bar = document.createElement("div");
  const canvas = document.createElement("canvas"), words = document.createElement("span");
  let drag = null, waiting = null, busy = 0, count = 0;
  const shown = () => model.get("shown");
  const send = (order) => { busy = ++count; model.set("asked", { n: count, ...order }); model.save_changes(); };
  const soon = (order) => {
    if (!busy) return send(order);
    waiting = { ...order, first: order.first || (waiting !== null && waiting.first) };
  };
  const draw = () => {
    if (!shown().scene) return;
    const ratio = Math.max(2, window.devicePixelRatio || 1), ctx = canvas.getContext("2d");
    [canvas.width, canvas.height] = [SIZE.width * ratio, SIZE.height * ratio];
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    paint(ctx, commands(shown(), ui));
    words.textContent = shown().words;
  };
  const button = (label, hint, act) => {
    const b = document.createElement("button");
    Object.assign(b, { textContent: label, title: hint, onclick: act });
    b.style.cssText = "padding:2px 8px;font-size:13px;cursor:pointer";
    bar.append(b);
    return b;
  };
  ADD.forEach((what) => button(`+ ${what}`, `one more ${what}`, () => send({ do: "add", what })));
  button("delete", "the selected part (Delete)", () => ui.selected !== null && send({ do: "remove", index: ui.selected }));
  button("receiver", "light is asked for along the selected part", () => ui.selected !== null && send({ do: "receive", index: ui.selected }));
  button("undo", "Ctrl+Z", () => send({ do: "undo" }));
  button("fit", "show everything", () => send({ do: "fit" }));
  const accepted = document.createElement("input");
  Object.assign(accepted, { type: "range", min: -3.5, max: -0.5, step: 0.1, value: -2, title: "error that the cache accepts, as a share of the largest E" });
  accepted.oninput = () => soon({ do: "tolerance", value: 10 ** Number(accepted.value) });
  bar.append("cache’s error", accepted);
  const file = document.createElement("input");
  Object.assign(file, { type: "file", accept: ".toml,.svg" });
  file.style.display = "none";
  file.onchange = async () => { const f = file.files[0]; if (f) send({ do: "load", name: f.name, text: await f.text() }); file.value = ""; };
  button("load", "a scene from .toml or .svg", () => file.click());
  [["toml", "save TOML"], ["svg", "save SVG"], ["python", "copy as Python"]].forEach(([what, label]) => button(label, label, () => send({ do: "text", what })));
  const place = (event) => {
    const r = canvas.getBoundingClientRect();
    return toWorld(fit(shown().scene.window, BOX.scene), [((event.clientX - r.left) * SIZE.width) / r.width, ((event.clientY - r.top) * SIZE.height) / r.height]);
  };
  canvas.onpointerdown = (event) => {
    const at = place(event), scale = fit(shown().scene.window, BOX.scene).scale;
    const handle = grabbed(shown().scene, at, REACH / scale);
    const owner = handle && handle.split(".")[0];
    ui.selected = owner === null || owner === "probe" ? null : Number(owner);
    if (handle) {
      const p = shown().scene.handles[handle];
      drag = { handle, by: [p[0] - at[0], p[1] - at[1]], first: true };
      canvas.setPointerCapture(event.pointerId);
    }
    draw();
  };
  canvas.onpointermove = (event) => {
    if (!drag) return;
    const at = place(event), to = [at[0] + drag.by[0], at[1] + drag.by[1]];
    soon({ do: "move", handle: drag.handle, to, first: drag.first });
    drag.first = false;
  };
  canvas.onpointerup = canvas.onpointercancel = () => { drag = null; };
  root.tabIndex = 0;
  root.onkeydown = (event) => {
    if (event.key === "Delete" && ui.selected !== null) send({ do: "remove", index: ui.selected });
    if (event.key === "z" && (event.ctrlKey || event.metaKey)) { event.preventDefault(); send({ do: "undo" }); }
  };
  const changed = () => {
    const parts = shown().scene ? shown().scene.parts.length : 0;
    if (ui.selected !== null && ui.selected >= parts) ui.selected = null;
    draw();
    if (shown().n >= busy) busy = 0;
    if (busy) return;
    if (waiting) { const next = waiting; waiting = null; send(next); }
    else if (shown().todo && shown().todo.length) setTimeout(() => busy || send({ do: "go on" }), 20);
  };
  const given = async () => {
    const { what, body } = model.get("text");
    if (!what) return;
    if (what === "python" && navigator.clipboard) {
      try { await navigator.clipboard.writeText(body); words.textContent = "Copied."; return; } catch (_) { /* a page without leave saves a file */ }
    }
    const link = document.createElement("a"), end = { toml: "toml", svg: "svg", python: "py" }[what];
    link.href = URL.createObjectURL(new Blob([body], { type: "text/plain" }));
    link.download = `scene.${end}`;
    link.click();
    URL.revokeObjectURL(link.href);
  };
  bar.style.cssText = "position:sticky;top:0;z-index:2;display:flex;flex-wrap:wrap;gap:6px;align-items:center;background:#ffffff;color:#1f2937;padding:6px 0;font:13px system-ui,sans-serif";
  words.style.cssText = "min-width:18em;color:#4b5563";
  canvas.style.cssText = `width:100%;max-width:${SIZE.width}px;display:block;touch-action:none`;
  bar.append(words, file);
  root.append(bar, canvas);
  el.append(root);
  model.on("change:shown", changed);
  model.on("change:text", given);
  changed();
  return () => { model.off("change:shown", changed); model.off("change:text", given); };
}

export default { render };
