/** What does a map mark? Places, directions and lengths, drawn with a canvas's pen. */
import type { Spot } from "../core/movement/floorplan.ts";
import type { Inks } from "./inks.ts";

type Pen = CanvasRenderingContext2D;

/** A place, with a rim that keeps it apart from any cell. */
export function dot(pen: Pen, { x, y }: Spot, radius: number, colour: string, { rim }: Inks): void {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.strokeStyle = rim;
  pen.lineWidth = 2;
  pen.stroke();
  pen.fillStyle = colour;
  pen.fill();
}

/** One's own place, and a wedge where one looks. */
export function arrow(pen: Pen, { x, y }: Spot, yaw: number, inks: Inks): void {
  const ahead = -Math.PI / 2 - yaw;
  pen.fillStyle = inks.gaze;
  pen.beginPath();
  pen.moveTo(x, y);
  pen.arc(x, y, 22, ahead - 0.5, ahead + 0.5);
  pen.fill();
  dot(pen, { x, y }, 4, inks.mark, inks);
}

export function cross(pen: Pen, { x, y }: Spot, { mark, rim }: Inks): void {
  pen.beginPath();
  pen.moveTo(x - 6, y);
  pen.lineTo(x + 6, y);
  pen.moveTo(x, y - 6);
  pen.lineTo(x, y + 6);
  twice(pen, rim, mark);
}

/** How long things are, above a line from its lower left corner, to be seen on any cell. */
export function scaleLine(pen: Pen, { x, y }: Spot, length_px: number, text: string, { mark, rim }: Inks): void {
  pen.font = "11px system-ui, sans-serif";
  pen.lineJoin = "round";
  pen.beginPath();
  pen.moveTo(x, y - 4);
  pen.lineTo(x, y);
  pen.lineTo(x + length_px, y);
  pen.lineTo(x + length_px, y - 4);
  twice(pen, rim, mark);
  pen.strokeStyle = rim;
  pen.lineWidth = 3;
  pen.fillStyle = mark;
  pen.strokeText(text, x + 4, y - 6);
  pen.fillText(text, x + 4, y - 6);
}

/** Draws a line with a rim on both sides. */
function twice(pen: Pen, rim: string, mark: string): void {
  for (const [colour, width] of [
    [rim, 4],
    [mark, 1.5],
  ] as const) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.stroke();
  }
}
