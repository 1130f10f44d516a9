// The page: what the server tells goes to its parts, and what they look at to the server.

import { byId, clock, period, span, write } from "./document.js";
import { Curves, MOST } from "./curves.js";
import { Setting } from "./setting.js";
import { Table } from "./table.js";
import { Tasks } from "./tasks.js";
import { showAlarms, showForces, showUnknown } from "./lists.js";

// Before a look is told: scrolling changes it often.
const LOOK_DELAY_MS = 80;
const RETRY_MS = 2000;
// The server takes a page for gone that does not say what it looks at for some such times.
const ALIVE_MS = 10000;
// A tab that nobody sees is told nothing after that time.
const HIDDEN_MS = 5000;
const FIRST_CURVES = 3;
// For how long good news stands.
const NEWS_MS = 10000;

const signals = new Map();
const told = { look: "", at: 0, list: -1 };
const known = { alarms: [], process: [], forces: [] };
let page = null;
let state = { state: "", node: null };
let source = null;
let isLost = false;
let lookTimer = 0;
let hiddenTimer = 0;

const curves = new Curves(() => {
  remember();
  table.arrange();
});
const table = new Table({
  looked: look,
  chosen: signal => {
    setting.show(signal, table.lines.get(signal.name));
    table.mark(signal.name);
  },
  plotted: (signal, isShown) => {
    const could = curves.toggle(signal, isShown);
    if (!could) setting.tell(`a page shows at most ${MOST} curves; remove one first`, "refused");
    return could;
  },
});
table.isShown = name => curves.has(name);
const setting = new Setting(() => table.mark(null));
const tasks = new Tasks();

/** Says what the page looks at, if that is news or was not said for a while. */
function look() {
  clearTimeout(lookTimer);
  lookTimer = setTimeout(async () => {
    if (!page) return;
    const chosen = setting.signal ? [setting.signal.name] : [];
    const rows = [...new Set([...curves.names(), ...chosen, ...(table.inSight ?? [])])];
    const body = JSON.stringify({ page, look: { rows, curves: curves.names() } });
    if (body === told.look && performance.now() - told.at < ALIVE_MS / 2) return;
    [told.look, told.at] = [body, performance.now()];
    try {
      await fetch("/look", { method: "POST", headers: { "Content-Type": "application/json" }, body });
    } catch {
      told.look = "";
    }
  }, LOOK_DELAY_MS);
}

const key = () => `isochrone-curves-${state.node?.node}`;

function remember() {
  try {
    localStorage.setItem(key(), JSON.stringify(curves.names()));
  } catch {
    // A browser that keeps nothing forgets which curves these were.
  }
}

function remembered() {
  try {
    return JSON.parse(localStorage.getItem(key()))?.filter(name => signals.has(name)) ?? [];
  } catch {
    return [];
  }
}

/** The node has these signals now. */
async function readSignals(version) {
  told.list = version;
  let list;
  try {
    list = await (await fetch("/signals")).json();
  } catch {
    told.list = -1;
    return;
  }
  signals.clear();
  for (const signal of list) signals.set(signal.name, signal);
  curves.keep(signals);
  if (curves.names().length === 0) {
    const known = remembered();
    const first = list.filter(signal => signal.type === "LREAL" && ["input", "output"].includes(signal.role));
    const chosen = known.length > 0 ? known : first.slice(0, FIRST_CURVES).map(signal => signal.name);
    for (const name of chosen.slice(0, MOST)) curves.add(signals.get(name));
  }
  table.set(list);
}

function showState() {
  const { node, state: now, why } = state;
  if (!node || isLost) return;
  const isThere = now === "runs";
  write(byId("node"), node.node);
  document.title = `${node.node} – isochrone view`;
  const words = { runs: "runs", ended: "has ended; looking for it", silent: "does not answer; looking for it" };
  write(byId("state"), words[now] ?? now);
  byId("state").className = `state ${isThere ? "runs" : "gone"}`;
  const up = isThere ? `up ${span(Date.now() / 1000 - node.started_unix_ns / 1e9)}` : "";
  const changed = node.configuration.changed ? " (changed since the start)" : "";
  const periods = node.tasks.map(task => period(task.period_ns)).join(", ");
  const access = setting.isWritable && setting.token ? "parameters can be set" : "read only";
  const facts = [`${node.configuration.file}${changed}`, `every ${periods}`, up, access, ...(state.twins ?? [])];
  write(byId("facts"), facts.filter(Boolean).join(" · "));
  if (!isThere) notice(`${now === "ended" ? "The node is gone" : "The node is silent"}: ${why}. Values come again when it is back.`);
  else if (showState.before && showState.before !== "runs") {
    const text = `The node came back at ${clock()}.`;
    notice(text, "good");
    setTimeout(() => byId("notice").textContent === text && notice(""), NEWS_MS);
  }
  showState.before = now;
  curves.isLive = isThere;
  tasks.describe(node.tasks, isThere);
  setting.access = node.control;
  setting.update(setting.signal && table.lines.get(setting.signal.name));
}

function showLists() {
  if (state.state !== "runs") return showUnknown();
  showAlarms(known.alarms, known.process, setting.mayChange() ? acknowledge : null);
  showForces(known.forces);
}

async function acknowledge(alarm) {
  notice(await setting.acknowledge(alarm), "bad");
}

function notice(text, kind = "") {
  const element = byId("notice");
  element.hidden = text === "";
  element.className = kind;
  write(element, text);
}

/** What is shown is not true any more. */
function showLost() {
  if (isLost) return;
  isLost = true;
  notice("No connection to isochrone view: it has ended, or serves as many pages as it can. Trying again.");
  byId("state").className = "state gone";
  write(byId("state"), "not connected");
  if (state.node) write(byId("facts"), state.node.configuration.file);
  table.forget();
  curves.lose();
  curves.tell(table.lines);
  if (state.node) tasks.describe(state.node.tasks, false);
  showUnknown();
}

const handlers = {
  hello: hello => {
    page = hello.page;
    isLost = false;
    state = { state: "", node: null };
    setting.isWritable = hello.writable;
    told.look = "";
    curves.begin();
    notice("");
    look();
  },
  state: now => {
    const isOther = now.state !== state.state;
    state = now;
    showState();
    if (isOther) showLists();
    if (now.list !== told.list && now.node) readSignals(now.list);
  },
  alarms: alarms => {
    known.alarms = alarms;
    showLists();
  },
  process: process => {
    known.process = process;
    showLists();
  },
  forces: forces => {
    known.forces = forces;
    showLists();
  },
  jitter: jitter => tasks.take(jitter),
  refused: refused => curves.refuse(refused),
  rows: lines => {
    table.take(lines);
    curves.tell(table.lines);
    setting.update(setting.signal && table.lines.get(setting.signal.name));
  },
  curves: news => curves.take(news),
};

function connect() {
  if (source || document.hidden) return;
  source = new EventSource("/events");
  for (const [name, handle] of Object.entries(handlers)) {
    source.addEventListener(name, event => handle(JSON.parse(event.data)));
  }
  source.addEventListener("error", () => {
    const isOver = source.readyState === EventSource.CLOSED;
    page = null;
    told.list = -1;
    showLost();
    if (isOver) {
      disconnect();
      setTimeout(connect, RETRY_MS);
    }
  });
}

function disconnect() {
  source?.close();
  [source, page] = [null, null];
  showLost();
}

document.addEventListener("visibilitychange", () => {
  clearTimeout(hiddenTimer);
  if (document.hidden) hiddenTimer = setTimeout(disconnect, HIDDEN_MS);
  else connect();
});
document.addEventListener("keydown", event => {
  const isTyping = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== "checkbox";
  if (event.key !== "/" || isTyping || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  byId("search").focus();
});
setInterval(showState, 1000);
setInterval(look, ALIVE_MS);
connect();
