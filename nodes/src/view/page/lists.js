// What is wrong, and what is forced.

import { byId, make, span, write } from "./document.js";

/** What was wrong or forced says nothing of a node that does not answer. */
export function showUnknown() {
  for (const kind of ["alarm", "force"]) {
    fill(`${kind}-list`, [], "–");
    write(byId(`${kind}-count`), "");
  }
}

function fill(id, items, none) {
  const list = byId(id);
  list.replaceChildren(items.length > 0 ? make("ul", { className: "list" }, ...items) : make("p", { className: "quiet" }, none));
}

const time = ns => new Date(ns / 1e6).toISOString().slice(0, 19).replace("T", " ");

/** `acknowledge` is what a button does with an alarm; without it there is none. */
function processItem(alarm, acknowledge) {
  const at = (word, moment) => moment ? `${word} ${time(moment.unix_ns)} UTC, cycle ${moment.cycle}, ${alarm.signal} = ${moment.value}` : "";
  const times = alarm.unacknowledged > 1 ? `${alarm.unacknowledged} times` : "";
  const facts = [`no. ${alarm.occurrence} of ${alarm.task}`, times, alarm.evaluated ? "" : "cannot be evaluated", at("first", alarm.first), at("last", alarm.last)];
  const item = make("li", {}, make("b", { className: "bad" }, alarm.name), ` ${alarm.severity}, ${alarm.state.replace("_", ", ")}: ${alarm.text} `,
    make("span", { className: "quiet" }, facts.filter(Boolean).join("; ")));
  if (acknowledge && alarm.unacknowledged > 0) {
    const button = make("button", { type: "button" }, "Acknowledge");
    button.addEventListener("click", () => acknowledge(alarm));
    item.append(" ", button);
  }
  return item;
}

export function showAlarms(alarms, process, acknowledge) {
  const item = alarm => {
    const status = alarm.status === null ? "" : ` 16#${alarm.status.toString(16).toUpperCase().padStart(4, "0")}`;
    const since = alarm.since_unix_ns ? `since ${time(alarm.since_unix_ns)} UTC, ` : "";
    const facts = `${since}cycle ${alarm.since_cycle} of ${alarm.task}, ${alarm.count === 1 ? "once" : `${alarm.count} times`}`;
    return make("li", {}, make("b", { className: "bad" }, alarm.name), `${status} ${alarm.meaning} `,
      make("span", { className: "quiet" }, facts));
  };
  const items = process.map(alarm => processItem(alarm, acknowledge)).concat(alarms.map(item));
  fill("alarm-list", items, "No alarm stands, no block reports an error, and every input is ok.");
  write(byId("alarm-count"), items.length > 0 ? ` (${items.length})` : "");
  byId("alarm-count").className = "bad";
}

export function showForces(forces) {
  const item = force => {
    const left = force.held ? "until it is released" : force.left_s === null ? "" : `${span(force.left_s)} left`;
    const by = force.client ? `by ${force.client}` : "";
    return make("li", {}, make("b", { className: "forced" }, force.name), ` at ${force.value} `,
      make("span", { className: "quiet" }, [left, by].filter(Boolean).join(", ")));
  };
  fill("force-list", forces.map(item), "Nothing is forced.");
  write(byId("force-count"), forces.length > 0 ? ` (${forces.length})` : "");
  byId("force-count").className = "forced";
}
