import type { PrimitiveName, SwitchState } from "../generated/primitives.ts";
import type { Words } from "./index.ts";

/** The primitives, in the order in which pages offer them. */
export const PRIMITIVES: Record<PrimitiveName, Words> = {
  pick: ["Pick", "Recoger"],
  place: ["Place", "Colocar"],
  approach: ["Approach", "Aproximar"],
  line: ["Line", "Línea recta"],
  move: ["Move joints", "Mover articulaciones"],
  gripper: ["Gripper", "Pinza"],
  home: ["Home", "Referenciar"],
};

/** The states that primitives switch, in steps of jobs. */
export const SWITCH_STATES: Record<SwitchState, Words> = { open: ["open", "abrir"], close: ["close", "cerrar"] };

/** The effect of each primitive, in a sentence. */
export const MEANINGS: Record<PrimitiveName, Words> = {
  pick: ["Goes down to the target with the gripper open, takes the part and lifts it.", "Baja al destino con la pinza abierta, recoge la pieza y la levanta."],
  place: ["Carries the part over the target, goes down, opens the gripper and goes up.", "Lleva la pieza sobre el destino, baja, abre la pinza y sube."],
  approach: ["Goes to the point above the target.", "Va al punto encima del destino."],
  line: ["Goes straight to the target.", "Va en línea recta al destino."],
  move: ["Goes to the target with all joints at once.", "Va al destino con todas las articulaciones a la vez."],
  gripper: ["Opens or closes the gripper.", "Abre o cierra la pinza."],
  home: ["Finds the switches of the axes and measures the position.", "Busca los finales de carrera de los ejes y mide la posición."],
};
