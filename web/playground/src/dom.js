// The page's parts by name, and what it says when something fails.

export const $ = (id) => document.getElementById(id);

const sentence = (error) => error.message.replace(/^ist: /, '');

export function tell(error) {
  $('alert-told').textContent = sentence(error);
  $('alert').hidden = false;
}
export function untell() {
  $('alert').hidden = true;
}
/** Runs what may fail; the page says why it did. */
export async function attempt(act) {
  try {
    await act();
  } catch (error) {
    tell(error);
  }
}
