import { type Component } from "vue";
import type { IconName } from "../../look/icon-names.ts";
import { lazy } from "../../look/lazy.ts";
import type { Words } from "../../words/index.ts";
import { WORKSHOP } from "../../words/workshop.ts";

/** A tool of the workshop: its name in the address, such as /workshop?tool=scope. */
export interface Tool {
  name: string;
  words: Words;
  icon: IconName;
  view: Component;
  /** Whether only a twin has it. */
  twin?: true;
}

export const TOOLS: readonly Tool[] = [
  { name: "overview", words: WORKSHOP.overview, icon: "activity", view: lazy(() => import("./Overview.vue")) },
  { name: "scope", words: WORKSHOP.scope, icon: "gauge", view: lazy(() => import("./Scope.vue")) },
  { name: "terminal", words: WORKSHOP.terminal, icon: "terminal", view: lazy(() => import("./Terminal.vue")) },
  { name: "configuration", words: WORKSHOP.configuration, icon: "settings", view: lazy(() => import("./Configuration.vue")) },
  { name: "calibration", words: WORKSHOP.calibration, icon: "crosshair", view: lazy(() => import("./Calibration.vue")) },
  { name: "faults", words: WORKSHOP.faults, icon: "triangle-alert", view: lazy(() => import("./Faults.vue")), twin: true },
  { name: "logs", words: WORKSHOP.logs, icon: "list-ordered", view: lazy(() => import("./Logs.vue")) },
];

/** Returns the tools of a twin or of a machine. */
export function toolsOf(twin: boolean): readonly Tool[] {
  return TOOLS.filter((one) => twin || one.twin === undefined);
}

/** Returns the tool of the name, the first one for an unknown name. */
export function toolOf(name: string | null): Tool {
  return TOOLS.find((one) => one.name === name) ?? (TOOLS[0] as Tool);
}
