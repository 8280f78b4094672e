// A document without a browser: it remembers what a script makes of it.
class FakeNode {
  constructor(name) { Object.assign(this, { name, attributes: {}, children: [], style: {}, value: "", hidden: false }); }
  setAttribute(key, value) { this.attributes[key] = String(value); }
  appendChild(child) { this.children.push(child); return child; }
  append(...children) { this.children.push(...children); }
  replaceChildren(...children) { this.children = children; }
  addEventListener() {}
}
globalThis.Node = FakeNode;
const named = new Map();
globalThis.document = {
  getElementById(id) { if (!named.has(id)) named.set(id, new FakeNode(id)); return named.get(id); },
  createElement: (name) => new FakeNode(name),
  createElementNS: (_, name) => new FakeNode(name),
  createTextNode: (text) => Object.assign(new FakeNode("#text"), { textContent: text }),
};
document.getElementById("data").textContent = JSON.stringify(DATA);
// All pictures of a part of the page, and all its texts.
function found(id) {
  const pictures = [], texts = [], look = (node) => {
    if (node.name === "svg") pictures.push({ attributes: node.attributes, parts: node.children.map(({ name, attributes, textContent }) => ({ name, attributes, text: textContent })) });
    else if (node.textContent) texts.push(node.textContent);
    (node.children ?? []).forEach(look);
  };
  look(document.getElementById(id));
  return { pictures, texts };
}
