const COLOURS: Record<string, string> = { red: "#e0563f", rojo: "#e0563f", green: "#4f9f3f", verde: "#4f9f3f", blue: "#3f86d8", azul: "#3f86d8", yellow: "#e0b83f", amarillo: "#e0b83f", purple: "#a86bd8", white: "#dfe4e8", black: "#3a3f45" };

/** Up to this tension [loads] a line of the robot has the colour `slack`; at its limit it has that of stop. */
export const SLACK = 0.7;

/** Returns the colour of a part: that of a colour word in its name, else one from the name. */
export function colourOf(name: string): string {
  const word = Object.keys(COLOURS).find((one) => name.toLowerCase().includes(one));
  if (word !== undefined) return COLOURS[word] as string;
  let sum = 0;
  for (const letter of name) sum = (sum * 31 + letter.charCodeAt(0)) % 360;
  return `hsl(${sum} 45% 55%)`;
}
