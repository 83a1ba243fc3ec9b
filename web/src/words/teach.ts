import { words } from "./index.ts";

export const TEACH = words({
  row: ["Row", "Fila"],
  column: ["Column", "Columna"],
});
