"use strict";
// Reads the values under the cursor out of the buckets that the page carries.
const { names, units, types, buckets, rowsPerBucket, rows, periodS, left, right, width } = JSON.parse(document.getElementById("data").textContent);
const figure = document.querySelector("figure");
const line = document.getElementById("cursor");
const cells = [...document.querySelectorAll("tbody td")];
const time = document.getElementById("time");

const number = value => Number(value.toPrecision(9)).toString();
const shown = {
  BOOL: value => value ? "TRUE" : "FALSE",
  WORD: value => "16#" + value.toString(16).toUpperCase().padStart(4, "0"),
};

function show(value, signal) {
  if (value === null) return "NaN or infinite";
  const text = shown[types[signal]] ?? number;
  const unit = units[signal] && ` ${units[signal]}`;
  return Array.isArray(value) ? `${text(value[0])} … ${text(value[1])}${unit}` : text(value) + unit;
}

function point(event) {
  const box = figure.querySelector("svg").getBoundingClientRect();
  const part = ((event.clientX - box.left) / box.width * width - left) / (right - left);
  if (part < 0 || part >= 1 || rows === 0) return;
  const bucket = Math.floor(part * rows / rowsPerBucket);
  const at = bucket * rowsPerBucket;
  const last = Math.min(at + rowsPerBucket, rows) - 1;
  const seconds = row => `${Number((row * periodS).toPrecision(9))} s`;
  time.textContent = last > at
    ? `${seconds(at)} … ${seconds(last)} (cycles ${at} … ${last}: least … greatest)` : `${seconds(at)} (cycle ${at})`;
  cells.forEach((cell, signal) => { cell.textContent = show(buckets[signal][bucket], signal); });
  line.style.left = `${box.left - figure.getBoundingClientRect().left + (left + part * (right - left)) / width * box.width}px`;
  line.hidden = false;
}

figure.addEventListener("pointermove", point);
figure.addEventListener("pointerdown", point);
