import { words } from "./index.ts";

export const TOUR = words({
  name: ["Tour", "Recorrido"],
  of: ["{number} of {count}", "{number} de {count}"],
  next: ["Next", "Siguiente"],
  back: ["Back", "Atrás"],
  end: ["End the tour", "Terminar"],
  finish: ["Done", "Listo"],
  stop: ["This button stops the robot. It is on every page, never asks, and works for everybody. While the robot moves, the space bar does the same.", "Este botón detiene el robot. Está en todas las páginas, nunca pregunta y funciona para todos. Mientras el robot se mueve, la barra espaciadora hace lo mismo."],
  stateTitle: ["The state of the robot", "El estado del robot"],
  state: ["This shows the state of the robot: not homed, ready, moving, paused, or a fault.", "Esto muestra el estado del robot: sin referenciar, listo, en movimiento, en pausa o con un fallo."],
  homeTitle: ["Home first", "Primero, referenciar"],
  home: ["After a start the robot does not know where it is. Home moves it slowly to its switches to find its position. Then it can move everywhere.", "Después de arrancar, el robot no sabe dónde está. Referenciar lo mueve despacio hasta sus finales de carrera para encontrar su posición. Después puede moverse a todas partes."],
  queueTitle: ["The queue", "La cola"],
  queue: ["Jobs wait here and run one after the other. You submit, order, hold and repeat them.", "Los trabajos esperan aquí y se ejecutan uno tras otro. Usted los envía, ordena, retiene y repite."],
  languageTitle: ["Language", "Idioma"],
  language: ["Change the language here, and the theme beside it. The page People has them too, with the units and this tour.", "Cambie aquí el idioma, y al lado el tema. También están en la página Personas, junto con las unidades y este recorrido."],
});
