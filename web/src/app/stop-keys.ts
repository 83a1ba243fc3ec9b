import { stop } from "../api/stop.ts";
import { activeHold } from "../parts/jog.ts";
import { state } from "../state/robot.ts";

/** Escape stops when it is pressed twice within this time [ms]. */
const TWICE = 600;

function inText(target: EventTarget | null): boolean {
  return target instanceof HTMLElement && target.closest("input:not([type=range], [type=checkbox], [type=radio]), textarea, [contenteditable]") !== null;
}

function active(): boolean {
  if (activeHold.value !== null) return true; // the robot may move, and no state has told so yet
  const now = state.value;
  return now !== null && (now.moving || now.mode === "homing" || now.mode === "moving");
}

/** Listens to the keys of stop: Space while anything moves or this page jogs, except in a text field, and Escape twice always. */
export function listenForStop(): void {
  let escaped = -TWICE;
  const onKey = (event: KeyboardEvent) => {
    if (event.key === " " && active() && !inText(event.target)) {
      event.preventDefault(); // it also keeps the focused button from being pressed
      event.stopPropagation();
      if (!event.repeat) void stop();
    } else if (event.key === "Escape" && !event.repeat) {
      const now = performance.now();
      if (now - escaped < TWICE) void stop();
      escaped = now;
    }
  };
  addEventListener("keydown", onKey, { capture: true });
}
