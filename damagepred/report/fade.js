"use strict";
// parts that are wider than the screen fade out at the edge beyond which they go on
for (const part of document.querySelectorAll(".scroll")) {
  const fade = () => part.classList.toggle("more", part.scrollLeft + part.clientWidth < part.scrollWidth - 2);
  part.addEventListener("scroll", fade, { passive: true });
  new ResizeObserver(fade).observe(part);
}
