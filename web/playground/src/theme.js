// Dark or light: the system's choice, or the visitor's.

const dark = matchMedia('(prefers-color-scheme: dark)');

/** `changed()` is called with every change; returns what reads a colour of the style sheet. */
export function theme(button, changed) {
  const root = document.documentElement;
  const isDark = () => root.dataset.theme ? root.dataset.theme === 'dark' : dark.matches;
  const tell = () => {
    button.textContent = isDark() ? 'Light' : 'Dark';
    button.setAttribute('aria-label', isDark() ? 'Light colours' : 'Dark colours');
    changed();
  };
  button.onclick = () => {
    root.dataset.theme = isDark() ? 'light' : 'dark';
    localStorage.setItem('theme', root.dataset.theme);
    tell();
  };
  dark.addEventListener('change', tell);
  tell();
}

export const colour = (name) =>
    getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
