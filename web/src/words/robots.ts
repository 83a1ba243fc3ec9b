import type { FleetRobot } from "../generated/api.ts";
import { words, type Words } from "./index.ts";

const GUIDE = "docs/how-to/supervisors-by-mqtt.md";

export const ROBOTS = words({
  none: ["This robot is connected to no broker, so no other robots are shown.", "Este robot no está conectado a ningún broker, así que no se muestran otros robots."],
  noneNext: ["Name the broker, then start the robot with its link to supervisors:", "Indique el broker y arranque el robot con su enlace a los supervisores:"],
  noneMore: [`How to set up a broker: ${GUIDE}`, `Cómo instalar un broker: ${GUIDE}`],
  startWithLink: ["Commands that start the robot with its link", "Órdenes que arrancan el robot con su enlace"],
  unsupported: ["The supervisors of this robot use a database ({broker}). Only an MQTT broker shows all its robots.", "Los supervisores de este robot usan una base de datos ({broker}). Solo un broker MQTT muestra todos sus robots."],
  broker: ["Broker", "Broker"],
  connecting: ["Connecting", "Conectando"],
  connected: ["Connected", "Conectado"],
  noLink: ["No connection", "Sin conexión"],
  lost: ["No connection to the broker since {time}. The robots are shown as they were then; they may still move.", "Sin conexión con el broker desde las {time}. Los robots se muestran como estaban entonces; aún pueden moverse."],
  refused: [`The broker does not let this robot's login read the steps of robots. Its administrator can allow it: ${GUIDE}`, `El broker no permite a la cuenta de este robot leer los pasos de los robots. Su administrador puede permitirlo: ${GUIDE}`],
  noStepSeen: [`No step has been seen since {time}. If a robot carries out a step now, the rules of the broker hide it from this robot's login: ${GUIDE}`, `No se ha visto ningún paso desde las {time}. Si un robot ejecuta un paso ahora, las reglas del broker lo ocultan a la cuenta de este robot: ${GUIDE}`],
  noRobots: ["The broker knows no robot yet. A robot appears here when it connects.", "El broker aún no conoce ningún robot. Un robot aparece aquí cuando se conecta."],
  onlyThis: ["The red button stops only {name}. Stop another robot at the robot itself, or on its own page.", "El botón rojo solo detiene a {name}. Detenga cualquier otro robot en el propio robot o en la página de ese robot."],
  more: ["{count} further robots are not shown.", "No se muestran otros {count} robots."],
  robotCount: ["{count} robots", "{count} robots"],
  oneRobot: ["1 robot", "1 robot"],
  thisRobot: ["this robot", "este robot"],
  from: ["from {name}", "de {name}"],
  unnamed: ["supervisor without a name", "supervisor sin nombre"],
  since: ["since {time}", "desde las {time}"],
  stepsWait: ["{count} steps wait", "{count} pasos esperan"],
  oneStepWaits: ["1 step waits", "1 paso espera"],
  lastSteps: ["Last steps", "Últimos pasos"],
  noSteps: ["No step seen yet.", "Aún no se ha visto ningún paso."],
  heard: ["Last message {ago}", "Último mensaje {ago}"],
  unheard: ["No message since this page's service started.", "Ningún mensaje desde que arrancó el servicio de esta página."],
  secondsAgo: ["{count} s ago", "hace {count} s"],
  minutesAgo: ["{count} min ago", "hace {count} min"],
  at: ["on {date}", "el {date}"],
  step: ["Step {id}", "Paso {id}"],
  canTeleop: ["Ask whether it is ready", "Preguntar si está listo"],
  done: ["done", "hecho"],
  failed: ["failed", "fallido"],
});

export const FLEET_STATES: Record<FleetRobot["state"], Words> = {
  idle: ["Idle", "Sin pasos"],
  waiting: ["A step waits", "Un paso espera"],
  working: ["Working", "Trabajando"],
  failed: ["Last step failed", "Falló el último paso"],
  offline: ["Offline", "Desconectado"],
  lost: ["Link lost", "Enlace perdido"],
  unknown: ["Unknown", "Desconocido"],
};
