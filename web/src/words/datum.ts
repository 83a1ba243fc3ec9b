import { words } from "./index.ts";

export const DATUM = words({
  title: ["Position of the robot", "Posición del robot"],
  needed: ["The robot cannot home alone: {reason}. Tell it where it stands.", "El robot no puede referenciarse solo: {reason}. Dígale dónde está."],
  bring: [
    "Slowly bring the robot to a pose that you can measure. Watch it: it stops at an active switch, and with torque readings at twice the load, but it does not know the table.",
    "Lleve el robot despacio a una pose que pueda medir. Obsérvelo: se detiene en un final de carrera activo y, con lecturas de par, con el doble de la carga, pero no conoce la mesa.",
  ],
  axis: ["Axis", "Eje"],
  moved: ["Axis {axis} has moved by {distance}.", "El eje {axis} se ha movido {distance}."],
  first: ["Measure the angle of the boom and both lines, from pulley to meeting point.", "Mida el ángulo del brazo y los dos cables, de la polea al punto de unión."],
  give: ["It stands here", "Está aquí"],
  unconfirmed: ["Motion is slow until a second pose confirms the position.", "El movimiento es lento hasta que una segunda pose confirme la posición."],
  second: ["Jog all three axes to another pose, and measure again.", "Mueva los tres ejes a otra pose y mida de nuevo."],
  confirm: ["Confirm", "Confirmar"],
  missing: ["Enter all three joints.", "Escriba los valores de las tres articulaciones."],
});
