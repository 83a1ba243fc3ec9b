import type { AuditedOperation, RoleName } from "../generated/api.ts";
import { t, words, type Words } from "./index.ts";

export const PEOPLE = words({
  // Sign in
  password: ["Password", "Contraseña"],
  token: ["Token", "Token"],
  way: ["How you sign in", "Cómo entra usted"],
  byPassword: ["With a password", "Con contraseña"],
  byToken: ["With a token", "Con un token"],
  signInHint: ["An administrator adds people on this page, or with: maya user add NAME. Stop works without signing in on the robot's computer.", "Un administrador añade personas en esta página, o con: maya user add NOMBRE. En el ordenador del robot, parar funciona sin entrar."],
  wrongPassword: ["The name or the password is wrong.", "El nombre o la contraseña no son correctos."],
  wrongToken: ["The token is wrong, expired or revoked.", "El token no es correcto, venció o fue revocado."],
  sessionEnded: ["Your session has ended. Sign in again; the page keeps what you see and what you typed.", "Su sesión terminó. Entre de nuevo; la página conserva lo que usted ve y lo que escribió."],
  codeFailed: ["The code does not work any more: it works once, and only for a short time. Show a new code on the other screen.", "El código ya no funciona: sirve una sola vez y por poco tiempo. Muestre un código nuevo en la otra pantalla."],

  // You
  you: ["You", "Usted"],
  from: ["This page is open at {place}.", "Esta página está abierta en {place}."],
  openTitle: ["No users yet", "Aún no hay usuarios"],
  openNow: ["Everybody on this computer may do everything. Other computers have no access.", "Cualquiera en este ordenador puede hacer todo. Otros ordenadores no tienen acceso."],
  openThen: ["After you add the first administrator, everybody signs in, also on this computer. Each person gets a role, and one person at a time drives.", "Cuando usted añada la primera cuenta de administración, todos entran con su cuenta, también en este ordenador. Cada persona tiene un rol, y una sola a la vez mueve el robot."],
  openStop: ["Stop keeps working for everybody on this computer, without signing in.", "Parar sigue funcionando para todos en este ordenador, sin entrar."],
  addFirst: ["Add the first administrator", "Añadir la primera cuenta de administración"],
  changePassword: ["Change my password", "Cambiar mi contraseña"],
  oldPassword: ["Present password", "Contraseña actual"],
  newPassword: ["New password", "Contraseña nueva"],
  passwordHint: ["At least 12 characters, 5 of them different.", "Al menos 12 caracteres, 5 de ellos distintos."],
  passwordEnds: ["All your sessions end. If you signed in with a password, this page asks you to sign in again.", "Todas sus sesiones terminan. Si usted entró con contraseña, esta página le pide entrar de nuevo."],
  passwordChanged: ["The password is changed.", "La contraseña se cambió."],
  passwordOptional: ["Password (optional; without it the user signs in with the token)", "Contraseña (opcional; sin ella se entra con el token)"],

  // Phone
  phone: ["Sign in on a phone", "Entrar con un teléfono"],
  phoneHow: ["Scan the code with the camera of the phone. The phone is then signed in as {name}.", "Escanee el código con la cámara del teléfono. El teléfono entra entonces como {name}."],
  phoneOnce: ["The code works once. It ends when you close this window, or on {date}.", "El código sirve una sola vez. Termina cuando usted cierra esta ventana, o el {date}."],
  phoneFor: ["The phone stays signed in for", "El teléfono queda conectado durante"],
  phoneAt: ["Address of this service for the phone", "Dirección de este servicio para el teléfono"],
  phonePlain: ["This address has no encryption: others on the network can read what is sent. Use it in a trusted network only.", "Esta dirección no tiene cifrado: otros en la red pueden leer lo que se envía. Úsela solo en una red de confianza."],
  phoneNot: ["A phone cannot reach this service: it listens on this computer only. Start it for other computers with: maya up --listen 0.0.0.0 --tls-cert FILE --tls-key FILE", "Un teléfono no alcanza este servicio: solo escucha en este ordenador. Arránquelo para otros ordenadores con: maya up --listen 0.0.0.0 --tls-cert ARCHIVO --tls-key ARCHIVO"],
  phoneShow: ["Show the code", "Mostrar el código"],
  phonePicture: ["QR code that signs a phone in", "Código QR que conecta un teléfono"],
  oneHour: ["1 hour", "1 hora"],
  twelveHours: ["12 hours", "12 horas"],
  sevenDays: ["7 days", "7 días"],

  // Control
  control: ["Control", "Control"],
  controlWhat: ["One person at a time moves the robot. Stop works for everybody.", "Una sola persona a la vez mueve el robot. Parar funciona para todos."],
  nobodyDrives: ["Nobody has control now.", "Nadie tiene el control ahora."],
  youDrive: ["You have control on this page.", "Usted tiene el control en esta página."],
  drives: ["{name} has control.", "{name} tiene el control."],
  drivesSince: ["Since {time}, from {place}.", "Desde las {time}, desde {place}."],
  implicit: ["Only until the command or job ends.", "Solo hasta que termine la orden o el trabajo."],
  note: ["Note", "Nota"],
  noteHint: ["Others see it, for example: aligning the tray", "Otros la ven, por ejemplo: alineando la bandeja"],
  takeFrom: ["Take control from {name}", "Quitar el control a {name}"],
  takeHere: ["Take control here", "Tomar el control aquí"],
  takeSure: ["Take control from {name}? If {name} is jogging the robot, it stops at once. A running job goes on, and you control it.", "¿Quitar el control a {name}? Si {name} está moviendo el robot manualmente, el robot se detiene al instante. Un trabajo en curso continúa, y usted lo controla."],
  askFor: ["Ask for control", "Pedir el control"],
  asked: ["You have asked. The person in control sees it for a minute.", "Usted lo pidió. La persona que tiene el control lo ve durante un minuto."],
  offerTo: ["Offer control to", "Ofrecer el control a"],
  offer: ["Offer", "Ofrecer"],
  offered: ["Control is offered to {name} for a minute.", "El control se ofrece a {name} durante un minuto."],
  asksYou: ["{name} asks for control.", "{name} pide el control."],
  offersYou: ["Control of the robot is offered to you.", "Se le ofrece el control del robot."],
  handOver: ["Offer it to {name}", "Ofrecerlo a {name}"],
  notNow: ["Not now", "Ahora no"],

  // Approvals
  approvals: ["Proposals", "Propuestas"],
  noProposals: ["No job waits for approval. The jobs of students appear here before they run.", "Ningún trabajo espera aprobación. Los trabajos de estudiantes aparecen aquí antes de ejecutarse."],
  proposedBy: ["proposed by {name}, {date}", "propuesto por {name}, {date}"],
  look: ["Review", "Revisar"],
  proposal: ["Proposal {job}: {name}", "Propuesta {job}: {name}"],
  previewed: ["Takes about {time}, at heights from {low} to {high} {unit}.", "Tarda aproximadamente {time}, a alturas de {low} a {high} {unit}."],
  previewTime: ["Takes about {time}.", "Tarda aproximadamente {time}."],
  previewing: ["The preview is computed", "Calculando la previsualización"],
  previewRefused: ["The job would stop at step {index} ({step}): {reason}", "El trabajo se detendría en el paso {index} ({step}): {reason}"],
  changedMeanwhile: ["{name} changed this job after you opened it. You see the new version now: look at it again, then approve it.", "{name} cambió este trabajo después de que usted lo abrió. Ahora ve la versión nueva: revísela otra vez y apruébela."],

  // Users
  users: ["Users", "Usuarios"],
  addUser: ["Add a user", "Añadir un usuario"],
  add: ["Add", "Añadir"],
  role: ["Role", "Rol"],
  lastUsed: ["last used {date}", "último uso {date}"],
  neverUsed: ["never used", "sin usar"],
  tokenCount: ["{count} tokens", "{count} tokens"],
  oneToken: ["1 token", "1 token"],
  withPassword: ["password", "contraseña"],
  edit: ["Edit", "Editar"],
  editUser: ["User {name}", "Usuario {name}"],
  setRole: ["Set the role", "Asignar el rol"],
  setPassword: ["Set the password", "Asignar la contraseña"],
  passwordOfUser: ["New password (empty removes it)", "Contraseña nueva (vacía la quita)"],
  removeUser: ["Remove the user", "Quitar el usuario"],
  removeSure: ["Remove {name} and all tokens of {name}? Open pages of {name} close at once.", "¿Quitar a {name} y todos los tokens de {name}? Las páginas abiertas de {name} se cierran al instante."],
  nameHint: ["Small letters, digits and . _ - (at most 32)", "Letras minúsculas, cifras y . _ - (32 como máximo)"],

  // Tokens
  tokens: ["Your tokens", "Sus tokens"],
  tokensOf: ["Tokens", "Tokens"],
  tokensWhat: ["A token signs a program, a notebook or a phone in. Create one for each, and revoke it when you no longer need it.", "Un token conecta un programa, un cuaderno o un teléfono. Cree uno para cada uno, y revóquelo cuando ya no lo necesite."],
  purpose: ["Purpose", "Propósito"],
  validFor: ["Valid for", "Válido por"],
  day: ["1 day", "1 día"],
  days: ["{count} days", "{count} días"],
  forever: ["no limit", "sin límite"],
  create: ["Create a token", "Crear un token"],
  revoke: ["Revoke", "Revocar"],
  revokeSure: ["Revoke it now? Its connections close at once.", "¿Revocarlo ya? Sus conexiones se cierran al instante."],
  thisPage: ["this page", "esta página"],
  sessionToken: ["session", "sesión"],
  expired: ["expired", "vencido"],
  until: ["until {date}", "hasta {date}"],
  noExpiry: ["does not expire", "no vence"],
  noNote: ["without a note", "sin nota"],
  phoneToken: ["phone", "teléfono"],
  codeToken: ["code for a phone, not used yet", "código para un teléfono, aún sin usar"],
  firstToken: ["first token", "primer token"],
  noTokens: ["No tokens.", "Sin tokens."],
  shownOnce: ["This is the token of {name}. It is shown only now: copy it and keep it secret.", "Este es el token de {name}. Se muestra solo ahora: cópielo y guárdelo en secreto."],
  done: ["I have copied it", "Ya lo copié"],

  // Audit
  audit: ["Audit log", "Registro de auditoría"],
  auditWhat: ["Requests, who made them, and their results, newest first.", "Peticiones, quién las hizo y sus resultados; lo más nuevo primero."],
  newest: ["Newest", "Lo más nuevo"],
  older: ["Older", "Más antiguas"],
  noOlder: ["There are no older entries.", "No hay entradas más antiguas."],
  when: ["When", "Cuándo"],
  who: ["Who", "Quién"],
  what: ["Request", "Petición"],
  result: ["Result", "Resultado"],
  granted: ["done", "hecho"],
  refused: ["refused ({code})", "rechazada ({code})"],

  // This device
  device: ["This device", "Este dispositivo"],
  showTour: ["Show the tour", "Mostrar el recorrido"],
  install: ["Install Maya as an app", "Instalar Maya como aplicación"],
  installHow: ["To install Maya as an app, use the menu of the browser.", "Para instalar Maya como aplicación, use el menú del navegador."],
  installInsecure: ["To install Maya as an app on this device, open it over https.", "Para instalar Maya como aplicación en este dispositivo, ábrala por https."],
});

export const ROLES: Record<RoleName, Words> = {
  viewer: ["viewer", "observador"],
  student: ["student", "estudiante"],
  operator: ["operator", "operador"],
  admin: ["administrator", "administrador"],
};

const ROLE_MEANING: Record<RoleName, Words> = {
  viewer: ["reads everything and may stop the robot", "lee todo y puede parar el robot"],
  student: ["proposes jobs, and drives when an operator offers control", "propone trabajos y mueve el robot cuando un operador le ofrece el control"],
  operator: ["drives the robot, changes the queue and approves jobs", "mueve el robot, cambia la cola y aprueba trabajos"],
  admin: ["drives the robot, manages users and tokens, and reads the audit log", "mueve el robot, gestiona usuarios y tokens, y lee el registro de auditoría"],
};

export function roleName(role: RoleName): string {
  return t(ROLES[role]);
}

/** Returns what a role may do. */
export function roleMeaning(role: RoleName): string {
  return t(ROLE_MEANING[role]);
}

const OPERATIONS: Record<AuditedOperation, Words> = {
  stop: ["stop", "parar"],
  abort: ["stop without deceleration", "parar sin desaceleración"],
  propose: ["propose a job", "proponer un trabajo"],
  submit: ["submit a job", "enviar un trabajo"],
  "change job": ["change a job", "cambiar un trabajo"],
  cancel: ["cancel a job", "cancelar un trabajo"],
  approve: ["approve a job", "aprobar un trabajo"],
  pause: ["pause", "poner en pausa"],
  command: ["command", "orden"],
  jog: ["jog", "mover manualmente"],
  resume: ["resume", "reanudar"],
  speed: ["change the speed", "cambiar la velocidad"],
  recover: ["clear a fault", "borrar un fallo"],
  datum: ["give or confirm the position", "indicar o confirmar la posición"],
  step: ["run one step", "ejecutar un paso"],
  graph: ["take part in the ROS graph", "participar en el grafo de ROS"],
  restart: ["decide about an interrupted job", "decidir sobre un trabajo interrumpido"],
  clear: ["cancel all waiting jobs", "cancelar todos los trabajos en espera"],
  zones: ["change the zones", "cambiar las zonas"],
  teach: ["teach a place", "enseñar un lugar"],
  lease: ["ask for or release control", "pedir o soltar el control"],
  renew: ["keep control", "conservar el control"],
  drive: ["take or offer control", "tomar u ofrecer el control"],
  break: ["take control by force", "tomar el control por la fuerza"],
  record: ["save a recording", "guardar una grabación"],
  configure: ["change the configuration", "cambiar la configuración"],
  backup: ["back up", "respaldar"],
  audit: ["read the audit log", "leer el registro"],
  diagnose: ["read the log of the program, or run the checks", "leer el registro del programa o ejecutar las comprobaciones"],
  inject: ["switch a fault of the twin", "activar o quitar un fallo del gemelo"],
  calibrate: ["calibrate", "calibrar"],
  terminal: ["send a command to the controller", "enviar un comando al controlador"],
  users: ["manage users", "gestionar usuarios"],
  me: ["change own account", "cambiar la cuenta propia"],
  read: ["read", "leer"],
  preview: ["preview a job", "previsualizar un trabajo"],
  "sign in": ["sign in", "entrar"],
};

/** Returns an operation of the audit log in words; one of another version of the service by its name. */
export function operationText(operation: string): string {
  const known = OPERATIONS[operation as AuditedOperation] as Words | undefined;
  return known === undefined ? operation : t(known);
}
