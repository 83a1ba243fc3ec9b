import { words } from "./index.ts";

export const PEOPLE = words({
  userName: ["Name", "Nombre"],
  password: ["Password or token", "Contraseña o token"],
  signInHint: ["An administrator adds people with: maya user add NAME", "Quien administra añade personas con: maya user add NOMBRE"],
});
