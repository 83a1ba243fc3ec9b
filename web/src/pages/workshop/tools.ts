import { type Component } from "vue";
import type { IconName } from "../../look/icon-names.ts";
import type { Words } from "../../words/index.ts";
import { WORKSHOP } from "../../words/workshop.ts";
import Calibration from "./Calibration.vue";
import Configuration from "./Configuration.vue";
import Faults from "./Faults.vue";
import Logs from "./Logs.vue";
import Overview from "./Overview.vue";
import Scope from "./Scope.vue";
import Terminal from "./Terminal.vue";

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
  { name: "overview", words: WORKSHOP.overview, icon: "activity", view: Overview },
  { name: "scope", words: WORKSHOP.scope, icon: "gauge", view: Scope },
  { name: "terminal", words: WORKSHOP.terminal, icon: "terminal", view: Terminal },
  { name: "configuration", words: WORKSHOP.configuration, icon: "settings", view: Configuration },
  { name: "calibration", words: WORKSHOP.calibration, icon: "crosshair", view: Calibration },
  { name: "faults", words: WORKSHOP.faults, icon: "triangle-alert", view: Faults, twin: true },
  { name: "logs", words: WORKSHOP.logs, icon: "list-ordered", view: Logs },
];

/** Returns the tools of a twin or of a machine. */
export function toolsOf(twin: boolean): readonly Tool[] {
  return TOOLS.filter((one) => twin || one.twin === undefined);
}

/** Returns the tool of the name, the first one for an unknown name. */
export function toolOf(name: string | null): Tool {
  return TOOLS.find((one) => one.name === name) ?? (TOOLS[0] as Tool);
}
