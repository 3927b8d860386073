export class IstError extends Error {
  constructor(message, status = 0) {
    super(message);
    this.name = 'IstError';
    this.status = status;
  }
}
