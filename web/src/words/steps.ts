import { words } from "./index.ts";

/** Texts of a list of steps. */
export const STEPS = words({
  predicted: ["predicted", "previsto"],
  actual: ["actual", "real"],
  more: ["{count} more steps", "{count} pasos más"],
});
