/** What does the element look like? It lives in a shadow tree, so nothing of the page's style reaches it. */
export const STYLE = `
:host {
  display: block;
  position: relative;
  aspect-ratio: 16 / 9;
  overflow: hidden;
  background: #11151b;
  color: #eef1f5;
  font: 13px/1.45 system-ui, sans-serif;
}
:host([hidden]) {
  display: none;
}
[hidden] {
  display: none !important;
}
canvas {
  display: block;
  width: 100%;
  height: 100%;
  touch-action: none;
  cursor: grab;
  outline: none;
}
canvas:focus-visible {
  outline: 2px solid #e8b96a;
  outline-offset: -2px;
}
.poster {
  position: absolute;
  inset: 0;
  cursor: auto;
  pointer-events: none;
}
.caption {
  position: absolute;
  left: 12px;
  right: 12px;
  top: 12px;
  bottom: 12px;
  display: flex;
  flex-wrap: wrap;
  justify-content: center;
  align-content: flex-end;
  align-items: flex-end;
  gap: 8px;
  pointer-events: none;
}
.caption button {
  padding: 6px 12px;
  border: 1px solid rgb(255 255 255 / 35%);
  border-radius: 10px;
  background: rgb(17 21 27 / 88%);
  color: inherit;
  font: inherit;
  cursor: pointer;
  pointer-events: auto;
}
.caption button:focus-visible {
  outline: 2px solid #e8b96a;
}
p {
  margin: 0;
  padding: 6px 12px;
  max-width: 100%;
  box-sizing: border-box;
  overflow-wrap: anywhere;
  pointer-events: auto;
  border-radius: 10px;
  background: rgb(17 21 27 / 88%);
}
.caption p {
  max-height: 70%;
  overflow: auto;
  scrollbar-width: thin;
  scrollbar-color: #a5afbc transparent;
}
.caption p:focus-visible {
  outline: 2px solid #e8b96a;
}
p:empty {
  display: none;
}
.unseen {
  position: absolute;
  width: 1px;
  height: 1px;
  overflow: hidden;
  clip-path: inset(50%);
  white-space: nowrap;
}
.over {
  position: absolute;
  inset: 0;
  pointer-events: none;
}
.stick {
  position: absolute;
  box-sizing: border-box;
  width: 96px;
  height: 96px;
  margin: -48px 0 0 -48px;
  border-radius: 50%;
  border: 2px solid rgb(255 255 255 / 35%);
  pointer-events: none;
}
.stick i {
  position: absolute;
  left: 50%;
  top: 50%;
  width: 40px;
  height: 40px;
  margin: -20px;
  border-radius: 50%;
  background: rgb(255 255 255 / 45%);
}
@media (forced-colors: active) {
  p,
  .caption button {
    background: Canvas;
  }
  .stick i {
    background: CanvasText;
  }
}
`;
