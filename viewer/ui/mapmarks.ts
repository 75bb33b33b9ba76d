/** What does a map mark? Places, directions and lengths, drawn with a canvas's pen. */
import type { Spot } from "../core/floorplan.ts";

export function dot(pen: CanvasRenderingContext2D, { x, y }: Spot, radius: number, colour: string): void {
  pen.fillStyle = colour;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fill();
}

/** One's own place, and a wedge where one looks. */
export function arrow(pen: CanvasRenderingContext2D, { x, y }: Spot, yaw: number): void {
  const ahead = -Math.PI / 2 - yaw;
  pen.fillStyle = "rgb(255 255 255 / 30%)";
  pen.beginPath();
  pen.moveTo(x, y);
  pen.arc(x, y, 22, ahead - 0.5, ahead + 0.5);
  pen.fill();
  dot(pen, { x, y }, 4, "#ffffff");
}

export function cross(pen: CanvasRenderingContext2D, { x, y }: Spot): void {
  pen.strokeStyle = "#ffffff";
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.moveTo(x - 6, y);
  pen.lineTo(x + 6, y);
  pen.moveTo(x, y - 6);
  pen.lineTo(x, y + 6);
  pen.stroke();
}

/** How long things are, above a line from its lower left corner; light on dark, to be seen on any cell. */
export function scaleLine(pen: CanvasRenderingContext2D, { x, y }: Spot, length_px: number, text: string): void {
  pen.font = "11px system-ui, sans-serif";
  pen.lineJoin = "round";
  for (const [colour, width] of [
    ["#11151b", 4],
    ["#eef1f5", 1.5],
  ] as const) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    pen.moveTo(x, y - 4);
    pen.lineTo(x, y);
    pen.lineTo(x + length_px, y);
    pen.lineTo(x + length_px, y - 4);
    pen.stroke();
  }
  pen.strokeStyle = "#11151b";
  pen.lineWidth = 3;
  pen.fillStyle = "#eef1f5";
  pen.strokeText(text, x + 4, y - 6);
  pen.fillText(text, x + 4, y - 6);
}
