/** The most commands that a terminal remembers. */
export const MOST_COMMANDS = 100;

/**
 * The earlier commands of a terminal. `back` and `forward` walk through them from the text that is being typed, which
 * comes back at the end.
 */
export class History {
  private commands: string[] = [];
  private at = 0;
  private draft = "";

  /** Remembers a command as the newest one; a repeated one is remembered once. */
  add(command: string): void {
    if (command && this.commands.at(-1) !== command) this.commands = [...this.commands, command].slice(-MOST_COMMANDS);
    this.at = this.commands.length;
    this.draft = "";
  }

  /** Returns the command before; at the oldest one it stays. */
  back(text: string): string {
    if (this.commands.length === 0) return text;
    if (this.at === this.commands.length) this.draft = text;
    this.at = Math.max(0, this.at - 1);
    return this.commands[this.at] as string;
  }

  /** Returns the command after, or the text that was being typed. */
  forward(text: string): string {
    if (this.at >= this.commands.length) return text;
    this.at += 1;
    return this.commands[this.at] ?? this.draft;
  }
}
